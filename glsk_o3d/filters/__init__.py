"""The filters, one a file, in the order of a pipeline: from a cloud to a finished skeleton."""
