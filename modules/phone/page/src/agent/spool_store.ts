// Stores keyframes and edits of anchors that wait for the server in the browser's IndexedDB, so that they are still there when the page is
// opened again.

import type { SpoolChange } from "./phone_agent";

const kStore = "keyframes";
const kPrefix = "pangea.spool.";

export const spoolOf = (agent: number) => `${kPrefix}${agent}`;

const done = <T>(request: IDBRequest<T>) =>
  new Promise<T>((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });

interface Entry {
  id: string;
  order: number; // counts the entries in the order of putting
  bytes: Uint8Array;
}

export class SpoolStore {
  private constructor(
    private readonly database: IDBDatabase,
    private nextOrder: number,
  ) {}

  static async open(name: string): Promise<SpoolStore> {
    const request = indexedDB.open(name, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(kStore, { keyPath: "id" });
    const database = await done(request);
    database.onversionchange = () => database.close(); // it is being removed
    const store = new SpoolStore(database, 0);
    store.nextOrder = ((await store.entries()).at(-1)?.order ?? -1) + 1;
    return store;
  }

  // Removes the spools of all agents. Changes of one that is open fail from then on.
  static async removeAll() {
    const names = (await indexedDB.databases()).map(({ name }) => name ?? "").filter((name) => name.startsWith(kPrefix));
    await Promise.all(names.map((name) => done(indexedDB.deleteDatabase(name))));
  }

  // All entries, in the order in which they were put.
  async entries(): Promise<Entry[]> {
    const all: Entry[] = await done(this.database.transaction(kStore).objectStore(kStore).getAll());
    return all.sort((a, b) => a.order - b.order);
  }

  // Applies all changes. If that fails, for instance on a full disk, only the deletions are applied, because they make room. Several calls
  // take effect in their order.
  async apply(changes: SpoolChange[]): Promise<void> {
    try {
      await this.write(changes);
    } catch (error) {
      await this.write(changes.filter(({ op }) => op === "delete"));
      throw error;
    }
  }

  close() {
    this.database.close();
  }

  // Writes all or nothing.
  private async write(changes: SpoolChange[]): Promise<void> {
    if (changes.length === 0) return;
    const transaction = this.database.transaction(kStore, "readwrite");
    const store = transaction.objectStore(kStore);
    for (const { op, id, bytes } of changes) {
      if (op === "put") store.put({ id, order: this.nextOrder++, bytes });
      else store.delete(id);
    }
    await new Promise((resolve, reject) => {
      transaction.oncomplete = resolve;
      transaction.onabort = () => reject(transaction.error);
    });
  }
}
