// Anchors in Unity, in a MonoBehaviour: `Listen`, and `ShowGroup` with the group of one's agent (`group` in /v1/agents), at first and when it
// changes: each group has a map frame of its own. `map` is the transform that stands for our frame (docs/anchors.md).

[System.Serializable] class Pose3 { public float[] position, orientation; }
[System.Serializable] class Anchor { public string type, id, name, payload, group; public Pose3 pose; }

static void Place(Transform t, Pose3 p) {
    t.localPosition = new Vector3(-p.position[1], p.position[2], p.position[0]);
    float[] q = p.orientation;  // w, x, y, z
    t.localRotation = new Quaternion(q[2], -q[3], -q[1], q[0]);  // x, y, z, w
}

public Transform map;
public GameObject prefab;
string ownGroup;
readonly Dictionary<string, Anchor> known = new Dictionary<string, Anchor>();
readonly Dictionary<string, GameObject> shown = new Dictionary<string, GameObject>();

void ShowGroup(string group) {
    ownGroup = group;
    foreach (var anchor in known.Values) Draw(anchor);
}

void Draw(Anchor anchor) {
    bool placed = anchor.pose?.position != null && anchor.pose.position.Length == 3;  // not if it is gone, or has no place now
    if (!placed || anchor.group != ownGroup) {
        if (shown.Remove(anchor.id, out var old)) Destroy(old);
        return;
    }
    if (!shown.ContainsKey(anchor.id)) shown[anchor.id] = Instantiate(prefab, map);
    Place(shown[anchor.id].transform, anchor.pose);
}

async Task Listen(CancellationToken stop) {
    while (!stop.IsCancellationRequested) {
        try { await Receive(stop); }
        catch (WebSocketException) { }  // no server there, or no longer
        await Task.Delay(1000, stop);
    }
}

async Task Receive(CancellationToken stop) {
    using var socket = new ClientWebSocket();
    await socket.ConnectAsync(new System.Uri("ws://127.0.0.1:8090/v1/events"), stop);
    foreach (var old in shown.Values) Destroy(old);  // all anchors come again, without those that were deleted meanwhile
    shown.Clear();
    known.Clear();
    var buffer = new byte[65536];
    while (socket.State == WebSocketState.Open) {
        int n = 0;
        WebSocketReceiveResult part;
        do {
            part = await socket.ReceiveAsync(new System.ArraySegment<byte>(buffer, n, buffer.Length - n), stop);
            n += part.Count;
        } while (!part.EndOfMessage);
        if (part.MessageType == WebSocketMessageType.Close) return;
        var anchor = JsonUtility.FromJson<Anchor>(System.Text.Encoding.UTF8.GetString(buffer, 0, n));
        known[anchor.id] = anchor;
        Draw(anchor);
    }
}
