"""A client of the service: columns of numbers in, columns of numbers out."""

from underskin.client.service_client import Client

__all__ = ["Client"]
