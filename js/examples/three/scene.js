// A room with two boxes under a spot light: Lambert surfaces only, lengths in metres.

import { BoxGeometry, Mesh, MeshLambertMaterial, PerspectiveCamera, Scene, SpotLight } from "three/webgpu";

export function makeScene() {
  const scene = new Scene();
  const box = ([width, height, depth], [x, y, z], colour, turn = 0) => {
    const material = new MeshLambertMaterial();
    material.color.setRGB(...colour);
    const mesh = new Mesh(new BoxGeometry(width, height, depth), material);
    mesh.position.set(x, y, z);
    mesh.rotation.y = turn;
    mesh.castShadow = mesh.receiveShadow = true;
    scene.add(mesh);
  };
  const [white, red, green] = [
    [0.73, 0.71, 0.68],
    [0.61, 0.06, 0.06],
    [0.12, 0.45, 0.1],
  ];
  box([2.2, 0.1, 2.2], [0, -0.05, 0], white);
  box([2.2, 0.1, 2.2], [0, 2.05, 0], white);
  box([2.2, 2.2, 0.1], [0, 1, -1.05], white);
  box([0.1, 2.2, 2.2], [-1.05, 1, 0], red);
  box([0.1, 2.2, 2.2], [1.05, 1, 0], green);
  box([0.6, 1.2, 0.6], [-0.35, 0.6, -0.3], white, 0.3);
  box([0.6, 0.6, 0.6], [0.35, 0.3, 0.35], white, -0.3);

  const lamp = new SpotLight(0xffffff, 8, 0, 0.9, 0.2);
  lamp.position.set(0.2, 1.9, 0.2);
  // glTF stores the direction of a light as its rotation.
  lamp.lookAt(0, 0, 0);
  lamp.add(lamp.target);
  lamp.target.position.set(0, 0, -1);
  lamp.castShadow = true;
  lamp.shadow.mapSize.set(1024, 1024);
  lamp.shadow.camera.near = 0.05;
  lamp.shadow.bias = -0.001;
  scene.add(lamp);

  const camera = new PerspectiveCamera(40, 1, 0.1, 20);
  camera.position.set(0, 1, 3.7);
  return { scene, camera };
}
