// Anchors in Unity: `Listen` from a MonoBehaviour; `map` is the transform that stands for our frame (docs/anchors.md).

[System.Serializable] class Pose3 { public float[] position, orientation; }
[System.Serializable] class Anchor { public string type, id, name, payload; public Pose3 pose; }

static void Place(Transform t, Pose3 p) {
    t.localPosition = new Vector3(-p.position[1], p.position[2], p.position[0]);
    float[] q = p.orientation;  // w, x, y, z
    t.localRotation = new Quaternion(q[2], -q[3], -q[1], q[0]);  // x, y, z, w
}

async Task Listen(Transform map, GameObject prefab, CancellationToken stop) {
    var shown = new Dictionary<string, GameObject>();
    using var socket = new ClientWebSocket();
    await socket.ConnectAsync(new System.Uri("ws://127.0.0.1:8090/v1/events"), stop);
    var buffer = new byte[65536];
    while (socket.State == WebSocketState.Open) {
        int n = 0;
        WebSocketReceiveResult part;
        do {
            part = await socket.ReceiveAsync(new System.ArraySegment<byte>(buffer, n, buffer.Length - n), stop);
            n += part.Count;
        } while (!part.EndOfMessage);
        var anchor = JsonUtility.FromJson<Anchor>(System.Text.Encoding.UTF8.GetString(buffer, 0, n));
        if (anchor.type == "gone" || anchor.pose?.position == null || anchor.pose.position.Length < 3) {  // or it has no place now
            if (shown.Remove(anchor.id, out var old)) Destroy(old);
            continue;
        }
        if (!shown.ContainsKey(anchor.id)) shown[anchor.id] = Instantiate(prefab, map);
        Place(shown[anchor.id].transform, anchor.pose);
    }
}
