% What `twin export A.h5 --format mat -o A.mat` wrote, stepped over a log as `twin run` does, in Octave.
%
%     octave-cli step_log.m A.mat loads.csv INITIAL STEP > sensors.csv
%
% INITIAL: degC of the whole machine; STEP: s. Columns are named as the artefact's signals, in the units below. A row
% per step edge, a column per sensor [degC]. Follows docs/artefact.md, "Step it"; indices of JSON count from 0, and its
% key "switch", a word of the language, is read as xSwitch.
1;

function r = where(c, a, b)
  z = zeros(size(c + a + b)); r = z + b; a = z + a; k = logical(z + c); r(k) = a(k);
end

function value = law(lines, use, gain, values, air)  % a table over the temperature that it reads, or a column
  surface_in = air + sign(-32:32) .* ((-32:32) / 32) .^ 4 * 100; ambient_in = air; temperature_in = -50:2.5:250;
  wired = {};
  if isstruct(use.signals), wired = fieldnames(use.signals); end
  for k = 1:numel(wired), eval([wired{k} '_in = values.' use.signals.(wired{k}) ';']); end
  eval(lines);
  value = gain * result + zeros(numel(air), 1);
end

function [values, t] = logged(path, signals)
  units = struct('mm', 1e-3, 'um', 1e-6, 'm_min', 1 / 60, 'mm_min', 1e-3 / 60, 'x1_min', 1 / 60, 'deg', pi / 180, ...
                 'min', 60, 'h', 3600, 'kW', 1e3, 'l_min', 1e-3 / 60);
  file = fopen(path); heads = strsplit(strtrim(fgetl(file)), ','); fclose(file);
  table = dlmread(path, ',', 1, 0, 'emptyvalue', NaN);
  for k = 1:numel(heads)
    parts = regexp(heads{k}, '^(.*) \[(.*)\]$', 'tokens'){1};
    unit = strrep(regexprep(parts{2}, '^1/', 'x1/'), '/', '_');
    if isfield(units, unit), table(:, k) *= units.(unit); end
    names{k} = parts{1};
  end
  t = table(:, 1) - table(1, 1);
  for s = signals(:)'
    column = find(strcmp(names, s.column));
    if isempty(column), v = repmat([s.default, NaN](1), numel(t), 1); else, v = table(:, column); end
    v = s.factor * v / merge(strcmp(s.kind, 'peak'), sqrt(2), 1);
    last = cummax(isfinite(v) .* (1:numel(t))');      % a gap holds what was before it
    last(last == 0) = find([isfinite(v); 1], 1);
    values.(s.name) = v(min(last, numel(t)));
  end
end

function m = mean_of(v, cut)  % over the steps, of rows that hold; what is constant stays so to the last digit
  base = v(cut.row(cut.first), :);
  m = base + cut.sum * ((v(cut.row, :) - base(cut.step, :)) .* cut.share);
end

function [w, part] = facing(stations, straight, from, to)  % weights (stations, m) along a path, shares of its time
  cuts = stations;
  if ! straight, cuts = (stations(2:end) + stations(1:end-1)) / 2; end
  s = unique(min(max([from; to; cuts], min(from, to)), max(from, to))); part = 1;
  if from != to
    middle = (s(2:end) + s(1:end-1)) / 2; half = diff(s) / 2;
    s = [middle - half / sqrt(3); middle + half / sqrt(3)]; part = [half; half]' / abs(to - from);
  end
  if straight
    s = min(max(s, stations(1)), stations(end)); i = min(lookup(stations, s), numel(stations) - 1);
    right = (s - stations(i)) ./ (stations(i+1) - stations(i)); k = (1:numel(s))';
    w = full(sparse([i; i + 1], [k; k], [1 - right; right], numel(stations), numel(s)));
  else
    w = eye(numel(stations))(:, sum(cuts < s', 1) + 1);
  end
end

function y = read(table, place)
  n = numel(table);
  if n == 1, y = table; return; end
  place = min(max(place, 0), n - 1); i = min(floor(place), n - 2);
  y = table(i + 1) + (place - i) * (table(i + 2) - table(i + 1));
end

function g = conductance(e, values, cut)
  g = repmat(e.conductance, numel(cut.first), 1);
  if isfield(e, 'area'), g *= e.area; end
  if ! isempty(e.xSwitch), g .*= 1 + (e.switched - 1) * mean_of(min(max(values.(e.xSwitch), 0), 1), cut); end
end

given = argv();
m = load(given{1}); d = jsondecode(m.log.load_model); dt = str2double(given{4});
reference = m.machine.reference_temperature_degC; films = d.films; sources = d.sources; ports = numel(d.ports);

% the machine: states of all bodies one after the other, columns at their global index
at = 0; N = numel(m.states); n_films = numel(films);
E = zeros(N); A0 = E; A = zeros(N, N, n_films + numel(d.joints)); C = zeros(numel(m.machine.sensors), N);
M = zeros(N, size(A, 3)); H = M; B = zeros(N, numel(sources)); B_out = B; P = zeros(N, ports); P_out = P;
one = zeros(N, 1); energy = one; raised = zeros(numel(d.axes), N, size(A, 3));
for k = 1:numel(m.affine)
  b = m.affine{k}; s = at + (1:numel(b.one)); at += numel(b.one);
  E(s, s) = b.E; A0(s, s) = b.A0; A(s, s, b.theta) = b.A; C(b.sensors, s) = b.C; M(s, b.theta) = b.M;
  B(s, b.sources) = b.B; B_out(s, b.sources) = b.B_out; P(s, b.ports) = b.P; P_out(s, b.ports) = b.P_out;
  one(s) = b.one; energy(s) = b.energy;
  if isfield(b, 'H'), H(s, b.theta) = b.H; end
  if isfield(b, 'raised'), raised(:, s, b.theta) = b.raised; end
end
M = M(:, 1:n_films); H = H(:, 1:n_films); raised = reshape(raised(:, :, 1:n_films), numel(d.axes), []);
sum_of = @(theta) reshape(reshape(A, N * N, []) * theta, N, N);
left = E' \ energy; area = (left' * M)'; area += area <= 0;
rows_of = zeros(n_films, N);
for k = 1:n_films, rows_of(k, :) = left' * A(:, :, k); end

% what the log drives, step by step
[values, t] = logged(given{2}, d.signals);
n = max(1, ceil(t(end) / dt - 1e-9)); edges = dt * (0:n)';
borders = union(t(t < edges(end)), edges);
cut.step = lookup(edges, borders(1:end-1)); cut.row = lookup(t, borders(1:end-1));
cut.share = diff(borders) / dt; cut.first = lookup(cut.step, (1:n)' - 0.5) + 1;
cut.sum = sparse(cut.step, 1:numel(cut.step), 1); last = [cut.first(2:end) - 1; numel(cut.step)];
for k = 1:numel(d.environments)
  e = d.environments(k); air(:, k) = repmat(e.temperature, numel(t), 1);
  if ! isempty(e.signal), air(:, k) = values.(e.signal); end
  air(:, k) += e.offset;
  if ! isempty(e.xSwitch), air(:, k) += e.switched_offset * values.(e.xSwitch); end
end
air_of = mean_of(air, cut);
for k = 1:n_films
  wired = films(k).use.signals; alone = ! isstruct(wired) || isempty(fieldnames(wired)); around = films(k).environment + 1;
  if alone
    film{k} = law(m.log.film_laws{k}, films(k).use, films(k).gain, values, air_of(:, around));
  else
    film{k} = mean_of(law(m.log.film_laws{k}, films(k).use, films(k).gain, values, air(:, around)), cut);
  end
end
for k = 1:numel(sources)
  of_rows{k} = law(m.log.source_laws{k}, sources(k).use, sources(k).gain, values, air(:, 1));
  power{k} = mean_of(of_rows{k}, cut);
end
joint = zeros(n, 0); gamma = cell(n, 1); gamma(:) = {zeros(ports)}; heat = zeros(ports, n);
for e = d.joints(:)', joint(:, end+1) = conductance(e, values, cut); end
for pair = d.pairs(:)'
  rail = d.rails(pair.rail + 1); stations = rail.stations(:); g = conductance(pair, values, cut);
  at = [rail.first_port + (1:numel(stations)), pair.pad_port + 1];
  way = interp1(t, values.(d.axes(pair.axis + 1).position), min(borders, t(end)));
  way = pair.station + merge(pair.rail_moves, -1, 1) * way;
  own = find(strcmp({sources.contact}, pair.contact)); share = [sources(own).rail_share];
  pairs = sum(strcmp({d.pairs.contact}, pair.contact));
  by_row = [of_rows{own}] / pairs; by_step = [power{own}] / pairs;
  for i = 1:n
    inside = cut.first(i):last(i); rests = all(way([inside, inside(end)+1]) == way(inside(1)));
    if rests, inside = inside(1); end
    for k = inside
      [w, part] = facing(stations, strcmp(pair.assignment, 'interpolated'), way(k), way(k+1));
      if ! rests, part *= cut.share(k); end
      to_pad = [-w; ones(1, numel(part))];
      gamma{i}(at, at) += g(i) * (to_pad .* part) * to_pad';
      if ! isempty(own)
        now = merge(rests, by_step(i, :), by_row(cut.row(k), :));
        heat(at(1:end-1), i) += (w * part') * (share * now');
      end
    end
    if ! isempty(own), heat(at(end), i) += (1 - share) * by_step(i, :)'; end
  end
end
place_of = zeros(n, 0); % of the axes, in the mean over a step
for axis = d.axes(:)'
  way = interp1(t, values.(axis.position), min(borders, t(end)));
  place_of(:, end+1) = cut.sum * (cut.share .* (way(1:end-1) + way(2:end)) / 2);
end
on_surface = strcmp({sources.contact}, '')';

% six stages with one factor
G = 0.3345; i = (1:6)'; beta(4:6, 1) = [17.3493; -13.6346; 3.6868];
conditions = [ones(1, 6); G * i'; G^2 * (i .* (i + 1))'];
beta(1:3) = conditions(:, 1:3) \ (1 - conditions(:, 4:6) * beta(4:6));
b = G * flipud(cumsum(flipud(beta))); c = G * i; c(1) = 0;
[~, most] = max(abs(b)); c(most) += (0.5 - b' * c) / b(most);
ahead = [0; c(2:end) / G - i(1:end-1)];

emissivity = [films.emissivity]'; around = [films.environment]' + 1; radiant_of = [films.radiant]' + 1;
gradient = [d.environments(around).gradient]'; height = [d.environments(around).height]';
x = (str2double(given{3}) - reference) * one; held = -1; substeps = m.log.substeps; r = substeps / (G * dt);
printf('%.16e,', (reference + C * x)(1:end-1)); printf('%.16e\n', (reference + C * x)(end));
for step = 1:n
  surface = reference + rows_of * x ./ area; radiant = air_of(step, radiant_of)';
  at_zero = air_of(step, around)' - gradient .* height;
  H_now = H; if columns(place_of), H_now += reshape(place_of(step, :) * raised, N, n_films); end
  apart = surface - at_zero - gradient .* (H_now' * left ./ area); large = max(abs(apart), 1e-6);
  place = 32 * (1 + apart ./ large .* (large / 100) .^ 0.25);
  for k = 1:n_films, h(k, 1) = read(film{k}(step, :), place(k)); end
  Ts = surface + 273.15; Tr = radiant + 273.15;
  radiation = emissivity * 5.670374419e-8 .* (Ts .^ 2 + Tr .^ 2) .* (Ts + Tr); total = h + radiation;
  outer = at_zero + radiation ./ (total + (total <= 0)) .* (radiant - at_zero);
  theta = [total; joint(step, :)'];
  if mod(step - 1, 64) == 0 || any(abs(theta - held) > 0.2 * held) || ! isequal(gamma{step}, gamma{step - 1})
    held = theta; inverse = inv(r * E + A0 + sum_of(held) + P * gamma{step} * P_out');
  end
  rest = sum_of(theta - held); twice = any(abs(theta - held) > 0.1 * held);
  forcing = M * (total .* (outer - reference)) + H_now * (h .* gradient) + P * heat(:, step);
  for substep = 1:substeps
    new = earlier = y = x;
    for stage = 1:6
      winding = reference + B_out' * (y + ahead(stage) * (y - earlier));
      for k = 1:numel(sources), q(k, 1) = read(power{k}(step, :), (winding(k) + 50) / 2.5); end
      known = forcing + B * (on_surface .* q) + r * (E * y); made = inverse * (known - rest * y);
      if twice, made = inverse * (known - rest * made); end
      new += b(stage) / G * (made - y); earlier = y; y = made;
    end
    x = new;
  end
  printf('%.16e,', (reference + C * x)(1:end-1)); printf('%.16e\n', (reference + C * x)(end));
end
