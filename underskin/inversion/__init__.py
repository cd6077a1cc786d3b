"""From a campaign's FRFs to the d33 of each sensor."""
