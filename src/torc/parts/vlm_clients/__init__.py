"""VLM clients; `--vlm`."""
