"""The planner `learned`: ranks objects by logistic regression over what DG-SELECT and BELIEF compute."""
