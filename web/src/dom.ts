// Short ways to make elements.

type Child = Node | string;

export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, string> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** A button with a drawing, named for those who cannot see it. */
export function iconButton(name: string, path: string, key: string, pressed: () => void): HTMLButtonElement {
  const button = element("button", { type: "button", "aria-label": name, title: `${name} (${key})` });
  button.innerHTML = icon(path);
  button.addEventListener("click", pressed);
  return button;
}

export function icon(path: string): string {
  return `<svg viewBox="0 0 24 24" width="20" height="20" aria-hidden="true"><path d="${path}"/></svg>`;
}

export function labelled(text: string, control: HTMLElement): HTMLLabelElement {
  return element("label", {}, element("span", {}, text), control);
}

/** The value of a CSS variable of the page. */
export function cssColour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
