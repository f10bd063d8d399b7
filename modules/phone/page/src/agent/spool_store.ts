// Stores keyframes and edits of anchors that wait for the server in the browser's IndexedDB, so that they are still there when the page is
// opened again.

import type { SpoolChange } from "./phone_agent";

const kStore = "keyframes";
const kPrefix = "pangea.spool.";
const kReopenPauses_ms = [0, 300, 1000]; // before each attempt; together less than the page waits for an agent to close
const kLongest_ms = 3000; // longest wait for another tab, which a phone may have suspended

export const spoolOf = (agent: number) => `${kPrefix}${agent}`;

const done = <T>(request: IDBRequest<T>) =>
  new Promise<T>((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });

// For a database that is opened or removed, which waits until other tabs have closed it. If it is opened too late, it is closed again.
function inTime(request: IDBOpenDBRequest): Promise<IDBDatabase> {
  let timer: ReturnType<typeof setTimeout>;
  const isLate = new Promise<never>((_, reject) => {
    timer = setTimeout(() => {
      reject(new Error("another tab of this page holds it"));
      request.onsuccess = () => request.result?.close();
    }, kLongest_ms);
  });
  return Promise.race([done(request), isLate]).finally(() => clearTimeout(timer));
}

interface Entry {
  id: string;
  order: number; // counts the entries in the order of putting
  bytes: Uint8Array;
}

export class SpoolStore {
  private isClosed = false; // by us
  private nextOrder = 0;
  private readonly kept = new Set<string>(); // ids of the entries
  private numGone = 0; // entries that were found missing, and not told yet
  private pending: SpoolChange[] = [];
  private applied: Promise<void> = Promise.resolve(); // resolves when none is pending

  private constructor(
    private readonly name: string,
    private database: IDBDatabase,
  ) {}

  static async open(name: string): Promise<SpoolStore> {
    const store = new SpoolStore(name, await connect(name));
    store.watch();
    const entries = await store.entries();
    store.nextOrder = (entries.at(-1)?.order ?? -1) + 1;
    for (const { id } of entries) store.kept.add(id);
    return store;
  }

  // Removes the spools of all agents. Changes of one that is open fail from then on.
  static async removeAll() {
    const names = (await indexedDB.databases()).map(({ name }) => name ?? "").filter((name) => name.startsWith(kPrefix));
    await Promise.all(names.map((name) => inTime(indexedDB.deleteDatabase(name))));
  }

  static async countOf(name: string): Promise<number> {
    const database = await connect(name);
    const count = await done(database.transaction(kStore).objectStore(kStore).count());
    database.close();
    return count;
  }

  // All entries, in the order in which they were put.
  async entries(): Promise<Entry[]> {
    const all: Entry[] = await done(this.database.transaction(kStore).objectStore(kStore).getAll());
    return all.sort((a, b) => a.order - b.order);
  }

  // Applies all changes. If that fails, for instance on a full disk, only the deletions are applied, because they make room. Several calls
  // take effect in their order. Also throws if the browser has removed entries, after it has applied the changes.
  apply(changes: SpoolChange[]): Promise<void> {
    this.pending.push(...changes);
    const now = () => this.applyPending();
    return (this.applied = this.applied.then(now, now));
  }

  close() {
    this.isClosed = true;
    this.database.close();
  }

  // Also those of later calls, so that slow attempts to open the database again do not queue up.
  private async applyPending() {
    const changes = this.pending.splice(0);
    try {
      await this.writeOrReopen(changes);
    } catch (error) {
      await this.write(changes.filter(({ op }) => op === "delete")).catch(() => {});
      throw error;
    }
    const { numGone } = this;
    this.numGone = 0;
    if (numGone > 0) throw new Error(`it has removed ${numGone} keyframes and anchors`);
  }

  // A browser may close a database that is open, for instance of a page in the background; not all tell so.
  private async writeOrReopen(changes: SpoolChange[]) {
    try {
      await this.write(changes);
    } catch (error) {
      if (this.isClosed || (error as DOMException | null)?.name === "QuotaExceededError") throw error;
      await this.reopen();
      await this.write(changes);
    }
  }

  private async reopen() {
    this.database.close();
    let failure: unknown;
    for (const pause_ms of kReopenPauses_ms) {
      if (pause_ms > 0) await new Promise((resolve) => setTimeout(resolve, pause_ms));
      try {
        this.database = await connect(this.name);
        this.watch();
        return await this.countGone();
      } catch (error) {
        failure = error;
      }
    }
    throw failure;
  }

  private watch() {
    this.database.onversionchange = () => this.close(); // it is being removed
  }

  // A browser that cleans up closes a database and removes it.
  private async countGone() {
    const left = new Set(await done(this.database.transaction(kStore).objectStore(kStore).getAllKeys()));
    for (const id of this.kept) if (!left.has(id) && this.kept.delete(id)) ++this.numGone;
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
    for (const { op, id } of changes) op === "put" ? this.kept.add(id) : this.kept.delete(id);
  }
}

function connect(name: string): Promise<IDBDatabase> {
  const request = indexedDB.open(name, 1);
  request.onupgradeneeded = () => request.result.createObjectStore(kStore, { keyPath: "id" });
  return inTime(request);
}
