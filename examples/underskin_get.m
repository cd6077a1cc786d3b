function text = underskin_get (address)
% UNDERSKIN_GET  Ask the service for something that it keeps, and return the answer's text; for MATLAB and GNU Octave.
%   text = underskin_get ('http://127.0.0.1:8000/v1/skins/palm-3/history')
%   The key, where the service needs one, is read from the environment variable UNDERSKIN_API_KEY.

  options = weboptions ('ContentType', 'text', 'Timeout', 60);
  if ~isempty (getenv ('UNDERSKIN_API_KEY'))
    options.HeaderFields = {'Authorization', ['Bearer ' getenv('UNDERSKIN_API_KEY')]};
  end
  text = webread (address, options);
end
