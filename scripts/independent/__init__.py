"""Parts of `scripts/independent_tests.py`: virtual tap tests that share no code with tapjoint."""
