"""3MF packages: their parts in XML, and the scene that is built of them."""
