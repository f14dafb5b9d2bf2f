"""``metro watch``: new files of a finished batch, compared with its model as soon as they are complete."""
