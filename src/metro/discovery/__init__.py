"""Discovery: for what stays unexplained, a search over a grammar of terms that physics admits."""
