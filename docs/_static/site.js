// The menu opens where the reader is.
addEventListener("DOMContentLoaded", () => {
  const menu = document.querySelector(".sidebar-scroll"), here = menu?.querySelector("[aria-current=page]");
  if (here) menu.scrollTop += here.getBoundingClientRect().top - menu.getBoundingClientRect().top - menu.clientHeight / 2;
});
