import "fake-indexeddb/auto";
import { forceCloseDatabase } from "fake-indexeddb";
import assert from "node:assert/strict";
import { test } from "node:test";
import { SpoolStore, spoolOf } from "./spool_store";

const put = (id: string, byte: number) => ({ op: "put" as const, id, bytes: new Uint8Array([byte]) });
const remove = (id: string) => ({ op: "delete" as const, id });
const ids = async (store: SpoolStore) => (await store.entries()).map(({ id }) => id);

test("what was put and not deleted is there again, in its order", async () => {
  const store = await SpoolStore.open("a");
  await store.apply([put("9", 9), put("10", 10), put("1", 1)]);
  await store.apply([remove("10"), put("2", 2)]);
  store.close();
  const again = await SpoolStore.open("a");
  assert.deepEqual(await ids(again), ["9", "1", "2"]);
  assert.deepEqual([...(await again.entries())[0].bytes], [9]);
});

test("changes take effect in the order of their calls, also those that nobody waits for", async () => {
  const store = await SpoolStore.open("b");
  void store.apply([put("1", 1)]);
  void store.apply([remove("1"), put("1", 2)]);
  await store.apply([put("3", 3)]);
  assert.deepEqual((await store.entries()).map(({ id, bytes }) => [id, bytes[0]]), [["1", 2], ["3", 3]]);
});

test("agents do not see each other's; what is not there may be deleted", async () => {
  const store = await SpoolStore.open("c");
  await store.apply([remove("nobody")]);
  assert.deepEqual(await ids(store), []);
});

test("on a full disk nothing is put, but what the server has is deleted", async () => {
  const store = await SpoolStore.open("d");
  await store.apply([put("1", 1), put("2", 2)]);
  const { put: realPut } = IDBObjectStore.prototype;
  IDBObjectStore.prototype.put = function (this: IDBObjectStore, ...entry: Parameters<typeof realPut>) {
    const request = realPut.apply(this, entry);
    this.transaction.abort();
    return request;
  };
  await assert.rejects(store.apply([remove("1"), put("3", 3)])).finally(() => (IDBObjectStore.prototype.put = realPut));
  assert.deepEqual(await ids(store), ["2"]);
  await store.apply([put("4", 4)]);
  assert.deepEqual(await ids(store), ["2", "4"]);
});

// A store, and its database, which a test can close as browsers do with a page in the background.
async function opened(name: string): Promise<[SpoolStore, IDBDatabase]> {
  const { open } = indexedDB;
  const databases: IDBDatabase[] = [];
  indexedDB.open = (...what) => {
    const request = open.apply(indexedDB, what);
    request.addEventListener("success", () => databases.push(request.result));
    return request;
  };
  const store = await SpoolStore.open(name).finally(() => (indexedDB.open = open));
  return [store, databases[0]];
}
const forceClose = (database: IDBDatabase) => forceCloseDatabase(database as unknown as Parameters<typeof forceCloseDatabase>[0]);

test("a database that the browser closes is opened again, and nothing is lost", async () => {
  for (const [name, close] of [["closed", forceClose], ["silent", (database: IDBDatabase) => database.close()]] as const) {
    const [store, database] = await opened(name);
    await store.apply([put("1", 1), put("2", 2)]);
    const during = store.apply([remove("1"), put("3", 3)]);
    close(database);
    await during;
    await Promise.all([store.apply([put("4", 4)]), store.apply([remove("4"), put("5", 5)])]);
    assert.deepEqual(await ids(store), ["2", "3", "5"], name);
  }
});

test("what the browser has removed is told once; what comes then is kept", async () => {
  const [store, database] = await opened("removed");
  await store.apply([put("1", 1), put("2", 2)]);
  forceClose(database);
  await new Promise((resolve) => (indexedDB.deleteDatabase("removed").onsuccess = resolve));
  await assert.rejects(store.apply([put("3", 3)]), /removed 2/);
  await store.apply([put("4", 4)]);
  assert.deepEqual(await ids(store), ["3", "4"]);
});

test("one that cannot be opened again is an error, until it can be", async () => {
  const [store, database] = await opened("gone");
  forceClose(database);
  const { open } = indexedDB;
  indexedDB.open = () => {
    throw new Error("no storage");
  };
  await assert.rejects(store.apply([put("1", 1), remove("0")]), /no storage/).finally(() => (indexedDB.open = open));
  await store.apply([put("2", 2)]);
  assert.deepEqual(await ids(store), ["2"]);
});

test("all are removed, also one that is open", async () => {
  const [one, other] = [await SpoolStore.open(spoolOf(7)), await SpoolStore.open(spoolOf(8))];
  await one.apply([put("1", 1)]);
  await other.apply([put("2", 2)]);
  other.close();
  await SpoolStore.removeAll();
  for (const agent of [7, 8]) assert.deepEqual(await ids(await SpoolStore.open(spoolOf(agent))), []);
  await assert.rejects(one.apply([put("3", 3)]));
});

test("a tab that does not let go is waited for, but not for ever", async () => {
  const held = await new Promise<IDBDatabase>((resolve) => {
    const request = indexedDB.open(spoolOf(9), 1);
    request.onupgradeneeded = () => request.result.createObjectStore("keyframes", { keyPath: "id" });
    request.onsuccess = () => resolve(request.result);
  });
  await assert.rejects(SpoolStore.removeAll(), /another tab/);
  await assert.rejects(SpoolStore.open(spoolOf(9)), /another tab/);
  held.close();
  assert.deepEqual(await ids(await SpoolStore.open(spoolOf(9))), []);
  await SpoolStore.removeAll();
});
