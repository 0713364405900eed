"""Where the camera is, by a board in the hand (camera fixed) or a fixed board (camera in the hand)."""
