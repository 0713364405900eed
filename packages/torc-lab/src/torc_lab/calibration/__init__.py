"""Calibrate the camera's pose, with a board in the hand (camera fixed) or a fixed board (camera in the hand)."""
