"""What a person or a timer starts: the command line, the main job, the demo."""
