// Keyframes that wait for the server, in the browser's IndexedDB: what was put and not deleted is there again when the page is
// opened anew.

import type { SpoolChange } from "./phone_agent";

const kStore = "keyframes";

const done = <T>(request: IDBRequest<T>) =>
  new Promise<T>((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });

export class SpoolStore {
  private constructor(private readonly database: IDBDatabase) {}

  static async open(name: string): Promise<SpoolStore> {
    const request = indexedDB.open(name, 1);
    // Numbered as they come, so that they come back in that order.
    request.onupgradeneeded = () =>
      request.result.createObjectStore(kStore, { autoIncrement: true }).createIndex("id", "id", { unique: true });
    return new SpoolStore(await done(request));
  }

  entries(): Promise<{ id: string; bytes: Uint8Array }[]> {
    return done(this.database.transaction(kStore).objectStore(kStore).getAll());
  }

  // All or nothing; transactions of one store happen in the order of these calls.
  async apply(changes: SpoolChange[]): Promise<void> {
    const transaction = this.database.transaction(kStore, "readwrite");
    const store = transaction.objectStore(kStore);
    for (const { op, id, bytes } of changes) {
      if (op === "put") store.add({ id, bytes });
      else store.index("id").getKey(id).onsuccess = ({ target }) => {
        const key = (target as IDBRequest<IDBValidKey | undefined>).result;
        if (key !== undefined) store.delete(key);
      };
    }
    await new Promise((resolve, reject) => {
      transaction.oncomplete = resolve;
      transaction.onabort = () => reject(transaction.error);
    });
  }

  close() {
    this.database.close();
  }
}
