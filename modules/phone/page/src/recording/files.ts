// The files of a folder that was dropped onto the page, by name.

export interface Files {
  names: string[]; // with their folders: "walk/mav0/imu0/data.csv"
  read(name: string): Promise<Uint8Array>;
}

export function filesOf(byName: Map<string, Blob>): Files {
  return {
    names: [...byName.keys()],
    read: async (name) => {
      const blob = byName.get(name);
      if (!blob) throw new Error(`${name} is missing`);
      return new Uint8Array(await blob.arrayBuffer());
    },
  };
}

// All files below a dropped folder. It must be called within the drop event, because the items are invalid afterwards.
export async function filesOfDrop(items: DataTransferItemList): Promise<Map<string, Blob>> {
  const entries = [...items].map((item) => item.webkitGetAsEntry()).filter((entry) => entry !== null);
  const byName = new Map<string, Blob>();
  for (const entry of entries) await addEntry(entry, byName);
  return byName;
}

async function addEntry(entry: FileSystemEntry, byName: Map<string, Blob>) {
  if (entry.isFile) {
    const file = await new Promise<File>((done, failed) => (entry as FileSystemFileEntry).file(done, failed));
    byName.set(entry.fullPath.replace(/^\//, ""), file);
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  for (;;) {
    // A reader returns about a hundred entries per call, and none at the end.
    const some = await new Promise<FileSystemEntry[]>((done, failed) => reader.readEntries(done, failed));
    if (some.length === 0) return;
    for (const child of some) await addEntry(child, byName);
  }
}
