"""Tables and states in files: .sto, .mot, .trc, and motions that were recorded."""
