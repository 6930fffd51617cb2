"""Things to look at: pictures, a page for the browser, a window."""
