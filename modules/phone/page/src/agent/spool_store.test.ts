import "fake-indexeddb/auto";
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

test("all are removed, also one that is open", async () => {
  const [one, other] = [await SpoolStore.open(spoolOf(7)), await SpoolStore.open(spoolOf(8))];
  await one.apply([put("1", 1)]);
  await other.apply([put("2", 2)]);
  other.close();
  await SpoolStore.removeAll();
  for (const agent of [7, 8]) assert.deepEqual(await ids(await SpoolStore.open(spoolOf(agent))), []);
  await assert.rejects(one.apply([put("3", 3)]));
});
