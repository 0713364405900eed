"""The planner `learned`: ranks objects by trees over what DG-SELECT and BELIEF reckon with."""
