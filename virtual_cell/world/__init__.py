"""What real cells do, always on in styles ``c`` and ``d``: one module for each thing of the world."""
