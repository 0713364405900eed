"""What is played: plain frozen data, from which everything else is made."""
