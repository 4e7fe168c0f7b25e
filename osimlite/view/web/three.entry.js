// What the page uses of three.js. three.js beside this file is made of it and of the npm package three 0.187.0 by
//   npm install three@0.187.0 esbuild && npx esbuild three.entry.js --bundle --minify --format=iife \
//     --global-name=THREE --banner:js="/*! three.js 0.187.0, MIT licence, see LICENSE-three */" --outfile=three.js
export {
  BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight, DoubleSide, GridHelper, Group,
  HemisphereLight, Line, LineBasicMaterial, Matrix4, Mesh, MeshStandardMaterial, PerspectiveCamera,
  Quaternion, Raycaster, Scene, SRGBColorSpace, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
