"""Reader of AddBiomechanics' files (.b3d): subject, models, trials and their frames."""
