"""The harder world: what real cells do, each thing of it drawn by a seed over the range that is published.

A folder for each family of batches: ``force``, ``arm``, ``faces``, ``boundary``. What more than one of them
uses lies beside the folders.
"""
