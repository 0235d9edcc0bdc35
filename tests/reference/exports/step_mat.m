% What `twin export A.h5 --format mat -o A.mat` wrote, stepped by implicit Euler in Octave or MATLAB.
%
%     octave-cli step_mat.m A.mat INPUT VALUE SECONDS STEPS
%
% INPUT is the number of an input that is held at VALUE; the others are zero. Prints the outputs, one per line.
arguments = argv();
m = load(arguments{1});
u = zeros(columns(m.B), 1);
u(str2double(arguments{2})) = str2double(arguments{3});
steps = str2double(arguments{5});
h = str2double(arguments{4}) / steps;
[L, U, p] = lu(m.E - h * m.A, 'vector');
x = zeros(rows(m.A), 1);
for k = 1:steps
  b = m.E * x + h * (m.B * u);
  x = U \ (L \ b(p));
end
y = m.C * x + m.D * u;
for k = 1:numel(y)
  printf('%s %.16e %s\n', m.outputs{k}, y(k), m.output_units{k});
end
