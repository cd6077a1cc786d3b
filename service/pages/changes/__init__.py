"""Changes of campaigns and skins, taken back."""
