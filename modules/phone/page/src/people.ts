// The names of the server's agents by id. They are fetched again from time to time, for people who join later.

const kRefresh_ms = 10_000;

export class People {
  private readonly names = new Map<number, string>();

  constructor() {
    void this.refresh();
    setInterval(() => void this.refresh(), kRefresh_ms);
  }

  nameOf(agent: number): string {
    return this.names.get(agent) || `agent ${agent}`;
  }

  private async refresh() {
    const answer = await fetch("/v1/info").catch(() => undefined);
    if (!answer?.ok) return;
    const { agents } = await answer.json();
    for (const { agent, name } of agents ?? []) this.names.set(agent, name);
  }
}
