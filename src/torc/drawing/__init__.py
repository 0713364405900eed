"""Pictures that people and models look at: marked scenes, graphs, beliefs, strips."""
