"""What users compare with: accuracy of solvers, worth of strict levels, random stacks (`taskopt bench`)."""
