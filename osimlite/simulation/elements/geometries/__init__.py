"""Where forces act: each geometry computes what a law is given, and applies what it gives."""
