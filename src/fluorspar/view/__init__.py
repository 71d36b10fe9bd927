"""The window of `fluorspar view`: a server of pictures and numbers, and the page that asks it."""
