// Anchors in three.js, and in WebXR below a node that `align` places (docs/anchors.md).

function place(object, pose) {
  const [x, y, z] = pose.position;
  const [qw, qx, qy, qz] = pose.orientation;
  object.position.set(-y, z, -x);
  object.quaternion.set(-qy, qz, -qx, qw);
}

// Draws the anchors of one group, because each group has a map frame of its own. Call the returned function with the group of one's agent
// (`group` in /v1/agents), at first and when it changes. `map`: the Object3D that stands for our frame.
function listen(url, map, makeObject) {
  const known = new Map(), shown = new Map();
  let ownGroup;
  function draw(anchor) {
    if (!anchor.pose || anchor.group !== ownGroup) {
      shown.get(anchor.id)?.removeFromParent();
      shown.delete(anchor.id);
      return;
    }
    if (!shown.has(anchor.id)) {
      shown.set(anchor.id, makeObject(anchor));
      map.add(shown.get(anchor.id));
    }
    place(shown.get(anchor.id), anchor.pose);
  }
  function connect() {
    const socket = new WebSocket(url);  // 'ws://127.0.0.1:8090/v1/events', with --allow-origin for this page
    socket.onopen = () => {  // all anchors come again, without those that were deleted meanwhile
      shown.forEach((object) => object.removeFromParent());
      shown.clear();
      known.clear();
    };
    socket.onmessage = ({data}) => {
      const anchor = JSON.parse(data);  // of type 'gone': without a pose
      known.set(anchor.id, anchor);
      draw(anchor);
    };
    socket.onclose = () => setTimeout(connect, 1000);
  }
  connect();
  return (group) => {
    ownGroup = group;
    known.forEach(draw);
  };
}

// Sets `map` (a child of the scene in the XR reference space) so that our map frame lies where it belongs. `T_map_body`: {position, orientation} of POSE_k;
// `T_body_viewer`: a Matrix4, the viewer (y up, −z forward) in the body, both in three.js' axes; from the calibration.
function align(map, T_map_body, T_body_viewer, viewerPose) {
  const body = new THREE.Object3D();
  place(body, T_map_body);
  body.updateMatrix();
  const T_map_viewer = body.matrix.clone().multiply(T_body_viewer);
  const T_xr_viewer = new THREE.Matrix4().fromArray(viewerPose.transform.matrix);
  const p_map_viewer = new THREE.Vector3().setFromMatrixPosition(T_map_viewer);
  const p_xr_viewer = new THREE.Vector3().setFromMatrixPosition(T_xr_viewer);
  const T_xr_map = T_xr_viewer.multiply(T_map_viewer.invert());
  const forward = new THREE.Vector3(0, 0, 1).transformDirection(T_xr_map);
  map.rotation.set(0, Math.atan2(forward.x, forward.z), 0);  // gravity is known: yaw alone, about the viewer
  map.position.copy(p_xr_viewer).sub(p_map_viewer.applyEuler(map.rotation));
}
