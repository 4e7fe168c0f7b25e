"""From the mechanism to the formats of other programs, with an account of what they cannot say."""
