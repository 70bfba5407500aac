// What is used of plotly.js.
declare module "plotly.js-basic-dist-min" {
  type Settings = Record<string, unknown>;
  const Plotly: {
    react(root: HTMLElement, traces: Settings[], layout: Settings, config: Settings): Promise<HTMLElement>;
  };
  export default Plotly;
}
