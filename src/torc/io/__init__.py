"""Files: strict readers for untrusted ones, records, results that appear whole, pictures, digests."""
