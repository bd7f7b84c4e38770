"""Sample budgets: stopping rules of a goal, and the reserve of a default picture."""
