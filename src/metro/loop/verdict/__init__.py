"""The verdict on an observable and the story of how it was reached."""
