"""All batches as one data set: the processed tables and the results, each as a view that SQL can ask."""
