"""Effects that a base model may lack: one file per effect, found and applied by ``library``."""
