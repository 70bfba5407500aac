"""Contact: what keeps surfaces apart, and friction between them."""

from qlb.contact.report import ContactReport
from qlb.contact.settings import Contact, ContactPair

__all__ = ["Contact", "ContactPair", "ContactReport"]
