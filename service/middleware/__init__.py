"""Between the socket and the routes: limits, request ids, the log of requests, errors."""
