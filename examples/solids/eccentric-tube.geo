// Soft tube with an eccentric bore, closed at both ends: half of it, y >= 0. Lengths in mm.
// gmsh -3 eccentric-tube.geo -o eccentric-tube.msh
SetFactory("OpenCASCADE");
Mesh.ElementOrder = 2;
Mesh.HighOrderOptimize = 2;
Mesh.MeshSizeMax = 2;
Cylinder(1) = {0, 0, 0, 0, 0, 60, 5};
Cylinder(2) = {1.2, 0, 3, 0, 0, 54, 3};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Box(4) = {-10, 0, -1, 20, 10, 62};
BooleanIntersection(5) = { Volume{3}; Delete; }{ Volume{4}; Delete; };
Physical Volume("body") = {5};
e = 1e-3;
Physical Surface("clamped_end") = Surface In BoundingBox {-10, -1, -e, 10, 10, e};
Physical Surface("free_end") = Surface In BoundingBox {-10, -1, 60 - e, 10, 10, 60 + e};
Physical Surface("symmetry") = Surface In BoundingBox {-10, -e, -1, 10, e, 61};
Physical Surface("bore") = Surface In BoundingBox {-1.9, -1, 3 - e, 4.3, 10, 57 + e};
