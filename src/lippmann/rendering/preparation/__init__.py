"""What is known of a picture's light before its first path: one door, :func:`.prepare.prepare_light`."""
