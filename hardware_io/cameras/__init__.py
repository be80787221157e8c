"""Pictures of cameras: devices, network streams, folders of pictures."""
