"""Things to look at: a page for the browser, a window, a picture in a notebook."""
