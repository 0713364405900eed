"""What tests, benchmarks and third parties need: synthetic scenes and fakes."""
