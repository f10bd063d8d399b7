// The names of the server's agents by id. They are fetched again from time to time, for people who join later.

const kRefresh_ms = 10_000;

export class AgentNames {
  private readonly names = new Map<number, string>();

  constructor() {
    void this.refresh();
    setInterval(() => void this.refresh(), kRefresh_ms);
  }

  nameOf(agent: number): string {
    return this.names.get(agent) || `agent ${agent}`;
  }

  private async refresh() {
    const told = await fetch("/v1/info").then((answer) => (answer.ok ? answer.json() : undefined)).catch(() => undefined);
    for (const { agent, name } of told?.agents ?? []) this.names.set(agent, name);
  }
}
