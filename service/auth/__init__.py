"""Who may do what: hosts, origins, API keys, sessions of browsers."""
