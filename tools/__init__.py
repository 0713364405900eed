"""What only builders of torc use; run from the checkout."""
