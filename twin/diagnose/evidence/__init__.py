"""What data can tell, whatever the cause: whitening, what calibration absorbs, model discrepancy, nulls, scores."""
