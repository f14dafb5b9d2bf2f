"""One module per kind of batch: what is cut, on what, with what; and what is hidden."""
