"""Problems and answers on plain arrays: hierarchies, quadratic programs, certificates, explanations."""
