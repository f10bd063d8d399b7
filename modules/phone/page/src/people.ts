// Who is who at this server, by the agents' ids; asked for again now and then, for those who come later.

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
