"""Neural networks that run in a process of their own: messages, the client, the server. Light to import."""
