"""How a script runs: its command line, files that appear whole, work folders, costs, versions."""
