"""Things of the world as they are, one module each: more of them, and in other terms, than models know."""
