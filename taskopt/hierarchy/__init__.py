"""Problems and answers: hierarchies and programs on plain arrays, their certificates, in words."""
