"""Files: strict readers for untrusted input, records, results that appear whole, pictures, digests."""
