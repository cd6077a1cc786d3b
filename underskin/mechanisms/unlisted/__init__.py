"""Laws that nobody listed: where one enters the model × what it follows × its form, each a mechanism like any other."""
