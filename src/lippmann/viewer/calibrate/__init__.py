"""The page on which a person turns a monitor's values until its test pattern stands still, and saves them."""
