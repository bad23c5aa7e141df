"""The paper side by side: every claim, what theory and simulation say, and a verdict."""
